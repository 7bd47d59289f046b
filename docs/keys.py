"""Write the reference of the case file, keys.md, beside this file.

python docs/keys.py
"""

from __future__ import annotations

from pathlib import Path

from feasibility.reports.keys import as_page

if __name__ == "__main__":
    Path(__file__).with_name("keys.md").write_text(as_page(), encoding="utf-8")
