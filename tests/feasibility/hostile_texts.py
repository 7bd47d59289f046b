"""TOML that is deep, long or broken, made from a seed."""

from __future__ import annotations

import random

KINDS = (
    "a{dots} = 1", "[a{dots}]", "[[a{dots}]]", "x = {{a{dots} = 1}}", "x = {open}1{close}",
    "x = {inline}1{ends}", "{many}", "{tables}", "{wide}", '"a\\""{quoted} = 1', "x = {digits}",
    "x = {open}", 'x = "{escapes}', "x = '''{dots}", "{dots}", "x = {{{wide_inline}}}",
)  # fmt: skip


def deep(rng: random.Random) -> str:
    """One text of at most 250 kB; tables of a case that are not there make it bad in any case."""
    n = rng.choice((17, 300, 5_000, 40_000))
    kind = rng.choice(KINDS)
    part = rng.choice(("a", "'a'", '"a"', '"é"'))
    return kind.format(
        dots=f".{part}" * (n if len(part) < 3 else n // 2),
        quoted='."a\\""' * n,
        open="[" * n,
        close="]" * n,
        inline="{a = " * (n // 2),
        ends="}" * (n // 2),
        many="\n".join(f"k{k}.a = 1" for k in range(min(n, 20_000))),
        tables="\n".join(f"[t.k{k}]" for k in range(min(n, 20_000))),
        wide="\n".join(f"{'b.' * 7}k{k} = 1" for k in range(min(n, 10_000))),
        wide_inline=", ".join(f"k{k} = 1" for k in range(min(n, 20_000))),
        digits="9" * n,
        escapes='\\"' * n,
    )[:250_000]
