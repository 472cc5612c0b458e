"""Pictures: the program's bytes, layers, and differences."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import trimray as tr


def test_a_picture_is_that_of_the_program_to_the_byte(scene, tmp_path):
    picture = scene.render(spp=8, aovs=["depth", "normal", "object"])
    assert picture.shape == (16, 24, 4) and picture.dtype == np.float32
    assert set(picture.layers) == {"depth", "normal", "object"}
    assert picture.layers["normal"].shape == (16, 24, 3) and picture.layers["object"].dtype == np.int32
    assert picture._repr_png_().startswith(b"\x89PNG") and picture.samples == (8, 8)
    scene.save(tmp_path / "s.toml")
    with open(tmp_path / "s.toml", encoding="utf-8") as file:
        text = file.read().replace("spp = 4", 'spp = 8\naovs = ["depth", "normal", "object"]')
    with open(tmp_path / "t.toml", "w", encoding="utf-8") as file:
        file.write(text)
    for name in ("p.exr", "p.png"):
        picture.save(tmp_path / name)
        command = [sys.executable, "-m", "trimray", "render", tmp_path / "t.toml", "-o", tmp_path / f"c{name}"]
        subprocess.run(command, check=True)
        with open(tmp_path / name, "rb") as own, open(tmp_path / f"c{name}", "rb") as want:
            assert own.read() == want.read()
    with pytest.raises(ValueError):
        picture[0, 0] = 1
    with pytest.raises(ValueError, match="only a picture as it was rendered"):
        (picture * 2).save(tmp_path / "x.exr")
    with pytest.raises(tr.InputError, match="unknown kind of picture"):
        picture.save(tmp_path / "x.jpg")
    with pytest.raises(tr.OutputError):
        picture.save(tmp_path / "no" / "x.exr")


def test_a_crop_is_a_part(scene):
    whole, part = scene.render(), scene.render(crop=(5, 3, 8, 6), threads=1)
    assert np.array_equal(whole[3:9, 5:13], part)


def test_pictures_differ(scene, tmp_path):
    a, b = scene.render(), scene.render(seed=1)
    assert tr.diff(a, a).status == "pass" and tr.diff(a, a).psnr == np.inf
    found = tr.diff(a, b, metric=["flip", "rmse"], layer={"A": "ignore"})
    assert found.status == "fail" and found.failing > 0
    assert set(found.metrics) == {"flip", "rmse"} and set(found.maps) == {"flip", "absolute"}
    assert found.maps["flip"].shape == (16, 24)
    assert np.isclose(found.maps["flip"].mean(), found.metrics["flip"], atol=1e-6)
    a.save(tmp_path / "a.exr")
    b.save(tmp_path / "b.exr")
    files = tr.diff(tmp_path / "a.exr", tmp_path / "b.exr", metric="flip", layer={"A": "ignore"})
    arrays = tr.diff(np.asarray(a), np.asarray(b, np.float64), metric="flip", layer={"A": "ignore"})
    assert files.metrics == arrays.metrics and files.rms_error == arrays.rms_error == found.rms_error
    assert tr.diff(a, b, fail=10.0, warn=10.0).status == "pass"
    for wrong, kind, message in [
        (np.zeros((16, 24, 4), np.uint8), TypeError, "^test: holds uint8"),
        (np.zeros((16, 24, 2)), ValueError, "^test: has the shape"),
        (np.zeros((3, 3, 4)), tr.InputError, "3x3"),
        (tmp_path / "no.exr", tr.InputError, "no.exr"),
    ]:
        with pytest.raises(kind, match=message):
            tr.diff(a, wrong)


def test_progress_is_told(scene):
    told = []
    scene.render(spp=64, progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (16 * 24 * 64, 16 * 24 * 64)
    with pytest.raises(ZeroDivisionError):
        scene.render(spp=64, progress=lambda done, total: 1 / 0)


@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="no such signal here")
@pytest.mark.parametrize("work", ["render", "trace"])
def test_interrupts_end_the_work(scene, work):
    main = threading.main_thread().ident
    timer = threading.Timer(0.5, lambda: signal.pthread_kill(main, signal.SIGINT))
    timer.start()
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        if work == "render":
            scene.render(size=(4096, 4096), spp=10_000)
        else:
            generator = np.random.default_rng(0)
            origins = np.broadcast_to(generator.normal(size=(1000, 1, 3)), (1000, 20_000, 3)).reshape(-1, 3)
            for _ in range(1000):
                scene.trace(origins, (0.5, 0.5, 0.5) - origins)
    assert time.monotonic() - started < 20


def test_the_program_is_there():
    script = os.path.join(os.path.dirname(sys.executable), "trimray")
    if not os.path.exists(script):
        pytest.skip("the package is not installed")
    said = subprocess.run([script, "--version"], check=True, capture_output=True, text=True)
    assert said.stdout.strip() == f"trimray {tr.__version__}"
    assert subprocess.run([script, "nonsense"], capture_output=True, check=False).returncode == 2
