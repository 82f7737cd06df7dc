import stat
from pathlib import Path

import pytest

from lippmann import Client
from lippmann.client.address import (
    FARM_FILE,
    Address,
    find_address,
    read_farm_file,
    remove_farm_file,
    write_farm_file,
    write_private,
)
from lippmann.errors import BadInput, NotAllowed, Unreachable

FARM = Address(url="http://127.0.0.1:8080", key="lip_a_b")


def test_a_farm_file_reads_back_as_it_was_written_and_is_its_users_alone(tmp_path: Path) -> None:
    write_farm_file(tmp_path, FARM)
    assert read_farm_file(tmp_path) == FARM
    assert stat.S_IMODE((tmp_path / FARM_FILE).stat().st_mode) == 0o600
    assert [path.name for path in tmp_path.iterdir()] == [FARM_FILE]
    remove_farm_file(tmp_path)
    assert read_farm_file(tmp_path) is None


def test_without_options_the_farm_of_the_folder_is_meant(tmp_path: Path) -> None:
    write_farm_file(tmp_path, FARM)
    assert find_address(url=None, key=None, data_dir=tmp_path) == FARM


def test_options_go_before_the_farm_of_the_folder(tmp_path: Path) -> None:
    write_farm_file(tmp_path, FARM)
    assert find_address(url="https://farm.example/", key="k", data_dir=tmp_path) == Address("https://farm.example", "k")
    assert find_address(url=None, key="k", data_dir=tmp_path) == Address(FARM.url, "k")


def test_a_key_may_be_that_of_a_file_with_its_line_end(tmp_path: Path) -> None:
    assert find_address(url="https://farm.example", key=" lip_a_b\r\n", data_dir=tmp_path).key == "lip_a_b"


def test_a_url_may_be_that_of_the_api(tmp_path: Path) -> None:
    write_farm_file(tmp_path, FARM)
    assert find_address(url=FARM.url + "/api/v1/", key=None, data_dir=tmp_path) == FARM


def test_the_farms_key_is_never_sent_to_another_service(tmp_path: Path) -> None:
    write_farm_file(tmp_path, FARM)
    assert find_address(url=FARM.url + "/", key=None, data_dir=tmp_path) == FARM
    with pytest.raises(NotAllowed, match="expected a key to http://elsewhere"):
        find_address(url="http://elsewhere", key=None, data_dir=tmp_path)


def test_the_key_of_a_service_may_be_in_the_file_that_the_service_wrote(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    key_file = tmp_path / "admin.key"
    monkeypatch.setenv("LIPPMANN_KEY_FILE", str(key_file))
    write_private(key_file, "lip_c_d\n")
    assert find_address(url=FARM.url, key=None, data_dir=tmp_path) == Address(FARM.url, "lip_c_d")
    assert find_address(url=FARM.url, key="k", data_dir=tmp_path).key == "k"
    write_farm_file(tmp_path, FARM)
    assert find_address(url=None, key=None, data_dir=tmp_path) == FARM, "the file is the key of another service"


def test_a_key_file_that_others_may_read_or_that_is_missing_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    key_file = tmp_path / "admin.key"
    monkeypatch.setenv("LIPPMANN_KEY_FILE", str(key_file))
    with pytest.raises(BadInput, match=r"admin\.key: No such file"):
        find_address(url=FARM.url, key=None, data_dir=tmp_path)
    key_file.write_text("lip_c_d\n")
    key_file.chmod(0o644)
    with pytest.raises(BadInput, match="chmod 600"):
        find_address(url=FARM.url, key=None, data_dir=tmp_path)


def test_no_service_anywhere_says_what_was_looked_for(tmp_path: Path) -> None:
    with pytest.raises(Unreachable, match="LIPPMANN_URL or a running farm"):
        find_address(url=None, key=None, data_dir=tmp_path)


@pytest.mark.parametrize("text", ["{", "[]", '{"url": 1}'])
def test_a_farm_file_that_is_none_is_refused_by_name(tmp_path: Path, text: str) -> None:
    (tmp_path / FARM_FILE).write_text(text)
    with pytest.raises(BadInput, match=FARM_FILE):
        read_farm_file(tmp_path)


def test_a_url_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="expected http:// or https://, got 'farm:8080'"):
        find_address(url="farm:8080", key="k", data_dir=tmp_path)


def test_a_client_without_arguments_finds_the_farm_as_the_command_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("URL", "KEY", "DATA_DIR"):
        monkeypatch.delenv(f"LIPPMANN_{name}", raising=False)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Unreachable, match="LIPPMANN_URL or a running farm"):
        Client()
    here, named = Address("http://127.0.0.1:1", "here"), Address("http://127.0.0.1:2", "named")
    for folder, farm in (("data", here), ("other", named)):
        (tmp_path / folder).mkdir()
        write_farm_file(tmp_path / folder, farm)
    assert Client().address == here
    monkeypatch.setenv("LIPPMANN_DATA_DIR", "other")
    assert Client().address == named
    assert Client(data_dir=tmp_path / "data").address == here
    monkeypatch.setenv("LIPPMANN_KEY", "own")
    assert Client().address == Address(named.url, "own")
    monkeypatch.setenv("LIPPMANN_URL", "https://farm.example")
    assert Client().address == Address("https://farm.example", "own")
    assert Client("https://elsewhere.example", "k").address == Address("https://elsewhere.example", "k")


def test_a_client_with_an_empty_key_sends_none_and_one_that_lacks_a_key_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("LIPPMANN_KEY", raising=False)
    assert Client("https://farm.example", "", data_dir=tmp_path).address.key == ""
    with pytest.raises(NotAllowed, match=r"expected a key to https://farm\.example in --key"):
        Client("https://farm.example", data_dir=tmp_path)
