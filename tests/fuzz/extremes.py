"""Values that have broken readers before: what is written in place of a sound one."""

WORDS = (
    "", " ", "nan", "NaN", "NA", "null", "None", "inf", "-inf", "Infinity", "true", "0", "-0.0", "+5", "1e308",
    "-1e308", "1e309",
    "1e-320", "1e400", "-1e999", "0x10", "1_000", "1,5", "1.234,5", "−1", "١٢", "½", "1e", "+", "--1", "1.5.2",
    ".", "5 mm", "1d3",
    "18446744073709551616", "9007199254740993", "1" * 400, "9" * 5000, "2020-01-01", "é", "🤖", "\u202e1",
    "\ufeff1", "\x00",
    "\x1b[31m", "a" * 70_000, "../x", "/dev/zero", "/", "%s%n", "{}", "=1+1", '"', "'", "<a>", "&amp;", "]]>",
    "a\nb", "a\rb",
)  # fmt: skip
"""As text, in a cell, an attribute or a string."""

NUMBERS = (
    0, -0.0, 1, -1, 0.5, 3, 7, 90, 180, 360, 1000, 1e-3, 1e-9, 1e9, 1e15, 1e16, 1e22, 1e100, 1e154, 1e155, 1e200,
    1e300, 1e308, -1e308,
    1.7976931348623157e308, 1e-100, 1e-300, 5e-324, 2**31, -(2**31) - 1, 2**53 + 1, 2**63, -(2**63) - 1, 2**64, 10**400,
    float("inf"), float("-inf"), float("nan"),
)  # fmt: skip
"""As numbers; whole ones beyond every machine's among them."""

OTHERS = (
    None,
    True,
    False,
    [],
    {},
    [1],
    [0.0, 0.0, 0.0],
    [[]],
    {"a": 1},
    [None],
    [1, "a"],
    "",
    "x",
    [1e308] * 3,
    [0.0] * 4,
)
"""Of another kind than what stood there."""
