"""The page in a browser is tested where one is installed (Debian: chromium, chromium-driver)."""

from __future__ import annotations

import shutil

collect_ignore = [] if shutil.which("chromedriver") else ["test_watch_page.py"]
