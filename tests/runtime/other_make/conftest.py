"""Tests against an OPC UA server of another make are there where node and node-opcua are installed
(`make build/opcua`), or where NODE_OPCUA names the folder of its node_modules.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

FOLDER = Path(os.environ.get("NODE_OPCUA", Path(__file__).parents[3] / "build" / "opcua"))
collect_ignore = (
    []
    if shutil.which("node") and (FOLDER / "node_modules" / "node-opcua").is_dir()
    else ["test_node_opcua.py"]
)
