"""How deep and how long a TOML text may be, judged before a parser sees it.

`tomllib` takes time and memory with the square of a dotted key's length, and one call of itself for
each bracket that is open.
"""

from __future__ import annotations

import re
from itertools import accumulate
from typing import Any

MOST_BRACKETS = 16  # open at once; control nets in pieces of a study need 7
MOST_PARTS = 8  # of one key, and tables inside each other; a study needs 5
MOST_KEYS = 50_000  # parts of all keys together

# What may hold brackets, dots and equals signs that mean nothing. A string that never ends goes to
# the end of its line or of the text; the parser refuses it there.
_STRINGS_AND_COMMENTS = re.compile(
    r'"""(?:[^\\"]|\\.|"{1,2}(?!"))*+"{0,5}'
    r"|'''(?:[^']|'{1,2}(?!'))*+'{0,5}"
    r'|"(?:[^\\"\n]|\\.)*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
_PATH = re.compile(r"(?<![\w-])[\w-]++(?:[ \t]*+\.[ \t]*+[\w-]++)*+")
_KEY = re.compile(
    rf"{_PATH.pattern}(?=[ \t]*+=)|^[ \t]*+\[\[?+[ \t]*+{_PATH.pattern}[ \t]*+\]", re.MULTILINE
)


def too_much(text: str) -> str:
    """What is too deep or too many in a TOML text; empty where nothing is.

    Example:
        >>> too_much("a = [[1, 2], [3, 4]]")
        ''
        >>> too_much("a = " + 20 * "[")
        'is nested too deeply: 20 brackets are open at once; at most 16 will do'
    """
    bare = _STRINGS_AND_COMMENTS.sub(lambda found: "" if found[0][0] == "#" else "s", text)
    steps = (1 if bracket in "[{" else -1 for bracket in re.findall(r"[\[\]{}]", bare))
    deepest = max(accumulate(steps), default=0)
    deep = "is nested too deeply:"
    if deepest > MOST_BRACKETS:
        return f"{deep} {deepest:,} brackets are open at once; at most {MOST_BRACKETS} will do"
    longest = max((found[0].count(".") for found in _PATH.finditer(bare)), default=0) + 1
    if longest > MOST_PARTS:
        return f"{deep} a key has {longest:,} parts; at most {MOST_PARTS} will do"
    keys = sum(1 + found[0].count(".") for found in _KEY.finditer(bare))
    return f"has {keys:,} keys; at most {MOST_KEYS:,} will do" if keys > MOST_KEYS else ""


def too_deep(tables: Any, above: int = 0) -> str:
    """What is too deep in tables that were read; empty where nothing is.

    Tables may lie inside each other as deep as a key may say, so that they can be written again.

    Args:
        tables: what the parser made of a text that is not `too_much`.
        above: tables that it will lie in.
    """
    if above > MOST_PARTS:
        return f"is nested too deeply: at most {MOST_PARTS} tables inside each other will do"
    inner = tables.values() if isinstance(tables, dict) else tables
    if not isinstance(tables, (dict, list)):
        return ""
    below = above + isinstance(tables, dict)
    return next(filter(None, (too_deep(value, below) for value in inner)), "")
