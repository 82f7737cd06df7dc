"""The variant of Mitsuba that works is found in a child process, and what is wrong is said."""

import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from worker.engines.mitsuba import version as versions
from worker.engines.mitsuba.version import Found, Missing, mitsuba_version, probe
from worker.sandbox.devices import Devices, nvidia_devices

OLD_LLVM = Path("/usr/lib/x86_64-linux-gnu/libLLVM-15.so")


def test_mitsuba_is_found_with_its_version_and_is_not_imported_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "mitsuba", raising=False)  # another test may have imported it
    mitsuba_version.cache_clear()
    found = mitsuba_version()

    assert isinstance(found, Found)
    assert found.version == version("mitsuba")
    assert found.variant == ("llvm_ad_rgb" if nvidia_devices() is None else "cuda_ad_rgb")
    assert "mitsuba" not in sys.modules


def test_a_variant_that_the_setting_names_is_the_only_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(versions, "nvidia_devices", lambda: None)
    monkeypatch.setenv("LIPPMANN_MITSUBA", "cuda_ad_rgb")
    mitsuba_version.cache_clear()
    missing = mitsuba_version()
    mitsuba_version.cache_clear()

    assert isinstance(missing, Missing)
    assert missing.reason.startswith("the variant cuda_ad_rgb needs a GPU of NVIDIA")


@pytest.mark.skipif(nvidia_devices() is not None, reason="there is a GPU of NVIDIA on this machine")
def test_where_a_gpu_does_not_work_the_processor_renders_and_the_reason_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(versions, "nvidia_devices", lambda: Devices((Path("/dev/null"),)))
    mitsuba_version.cache_clear()
    found = mitsuba_version()
    mitsuba_version.cache_clear()

    assert isinstance(found, Found)
    assert found.variant == "llvm_ad_rgb"
    assert found.note.startswith("the variant cuda_ad_rgb does not work: ")
    assert "CUDA" in found.note


def test_without_llvm_the_reason_says_what_to_install() -> None:
    missing = probe("llvm_ad_rgb", {"DRJIT_LIBLLVM_PATH": "/nowhere/libLLVM.so"})

    assert isinstance(missing, Missing)
    assert missing.reason == "no LLVM 16 or later that works: install libllvm19, or another LLVM of 16 or later"


@pytest.mark.skipif(not OLD_LLVM.exists(), reason="there is no LLVM 15 on this machine")
def test_an_old_llvm_ends_the_child_alone() -> None:
    missing = probe("llvm_ad_rgb", {"DRJIT_LIBLLVM_PATH": str(OLD_LLVM)})

    assert isinstance(missing, Missing)
    assert missing.reason.startswith("no LLVM 16 or later that works")


def test_a_variant_that_does_not_work_is_named_with_what_mitsuba_says() -> None:
    missing = probe("no_such_variant")

    assert isinstance(missing, Missing)
    assert missing.reason.startswith("the variant no_such_variant does not work: ")
    assert "no_such_variant" in missing.reason.removeprefix("the variant no_such_variant does not work: ")
