from tests.page_steps import steps_of


def test_the_steps_of_a_page_are_its_lines_for_a_shell_and_its_files_by_name() -> None:
    text = (
        "Type\n\n```sh\nmake setup\n```\n\nThe job, `a/b.json`, of `x.toml`:\n\n```json\n{}\n```\n\n```\nanswer\n```\n"
    )
    steps = steps_of(text)
    assert (steps.files, steps.commands) == ({"a/b.json": "{}\n"}, ("make setup\n",))
