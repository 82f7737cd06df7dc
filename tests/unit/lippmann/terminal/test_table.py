from lippmann.terminal.table import fields, table


def test_a_title_cannot_talk_to_the_terminal() -> None:
    assert "\x1b" not in table(("title",), [("\x1b[2Jgone",)])
    assert "\n" not in fields([("title", "two\nlines")])


def test_every_row_has_its_columns_at_the_same_place() -> None:
    lines = table(("id", "status"), [("a", "done"), ("longer", "failed")]).splitlines()
    assert [line.index(word) for line, word in zip(lines, ("STATUS", "done", "failed"), strict=True)] == [8, 8, 8]
