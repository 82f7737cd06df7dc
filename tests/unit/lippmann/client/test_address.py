import stat
from pathlib import Path

import pytest

from lippmann.client.address import FARM_FILE, Address, find_address, read_farm_file, remove_farm_file, write_farm_file
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


def test_the_farms_key_is_never_sent_to_another_service(tmp_path: Path) -> None:
    write_farm_file(tmp_path, FARM)
    assert find_address(url=FARM.url + "/", key=None, data_dir=tmp_path) == FARM
    with pytest.raises(NotAllowed, match="expected a key to http://elsewhere"):
        find_address(url="http://elsewhere", key=None, data_dir=tmp_path)


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
