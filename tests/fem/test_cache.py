"""The folder of compiled kernels: what lies there is executed, so it must be ours; else a temporary one serves."""

import os
import shutil
import tempfile
from pathlib import Path

import pytest

from stemcal.fem.kernels import compile as cache

POSIX = pytest.mark.skipif(os.name == "nt", reason="POSIX rights")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The configured folder of this user, with a compiled kernel in a folder of its own."""
    monkeypatch.setenv("STEMCAL_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    found = cache._cache_folder()
    (found / "kernels_1").mkdir()
    (found / "kernels_1" / "march.nbc").write_bytes(b"code")
    return found


def test_the_folder_is_this_users_alone(folder: Path) -> None:
    assert folder == cache._cache_folder()
    assert os.name == "nt" or folder.stat().st_mode & 0o777 == 0o700


def test_each_installation_has_its_own(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """numba finds a kernel by the place of its source: that one installation has compiled says nothing of others."""
    copy = shutil.copytree(Path(cache.__file__).parent, tmp_path / "elsewhere")
    monkeypatch.setattr(cache, "__file__", str(copy / "compile.py"))
    assert cache._cache_folder() != folder


def is_not_used(folder: Path) -> None:
    """Not used, but left as it is; the same folder among the temporary files serves all who look for one."""
    before = sorted(folder.rglob("*"))
    spare = cache._cache_folder()
    assert spare != folder and spare.stat().st_mode & 0o777 == 0o700 and list(spare.iterdir()) == []
    assert sorted(folder.rglob("*")) == before
    assert cache._cache_folder() == spare and spare.parent == Path(tempfile.gettempdir())


@POSIX
@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702])
def test_a_folder_that_others_may_write_is_not_used(folder: Path, mode: int) -> None:
    folder.chmod(mode)
    is_not_used(folder)


@POSIX
def test_a_folder_of_someone_else_is_not_used(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    me = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: me + 1)
    assert not cache._is_private(folder)


def test_what_cannot_be_made_is_replaced(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a read-only home."""
    (tmp_path / "a-file").write_bytes(b"")
    monkeypatch.setenv("STEMCAL_CACHE_DIR", str(tmp_path / "a-file"))
    spare = cache._cache_folder()
    assert spare.is_dir() and spare.name.endswith(folder.name) and spare == cache._cache_folder()
