"""The picture of the page and the film of the falling error: `python -m tests.page.picture`.

A hidden effect on short recordings, found and then added: ladder, missing torque with the law of
the first candidate, the arm in the colours of its error, and the ranking.
"""

from __future__ import annotations

import io
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

import viser
from PIL import Image
from playwright.sync_api import sync_playwright

from flexgui.jobs import JobPool
from flexgui.page.in_browser import plotly_script, run_javascript
from flexgui.server.viser_patches import skip_plotly_upload
from flexgui.session.session import Session
from tests.conftest import CHROMIUM, FLAGS, ROOT
from tests.page.conftest import Desktop, Offered
from tests.page.test_diagnose import few

FOLDER = ROOT / "docs" / "pictures"
PICTURE, FILM = FOLDER / "page.png", FOLDER / "fall.gif"
SIZE = {"width": 1600, "height": 900}
SETTLED = 4000
"""ms after which everything is drawn, without a graphics card too."""
AT = 0.4
"""s of the recording, where the arm is bent and fails."""
ADD = "Add Coulomb friction"
STEP, HELD = 250, 2500
"""ms between two pictures of the film, and for which its first and its last one stand."""
LONGEST = 80
"""Pictures, should the fit take long; those in which nothing changes are one."""
WIDTH, SHADES = 960, 200
"""px and colours: a README's pictures are a few hundred KB."""


class Served(Desktop):
    """Draws with the same Plotly as the server does; without viser's button to share."""

    def _connected(self, client: viser.ClientHandle) -> None:
        run_javascript(client, plotly_script())
        skip_plotly_upload(client)
        client.gui.configure_theme(show_logo=False, show_share_button=False)
        super()._connected(client)


def wait(session: Session) -> None:
    """Until nothing is computed."""
    while session.run.busy:
        time.sleep(0.2)


def film(page: Any) -> None:
    """Adds the effect and watches the error fall."""
    shots, times = [page.screenshot()], [HELD]
    page.get_by_role("button", name=ADD, exact=True).click()
    for _ in range(LONGEST):
        page.wait_for_timeout(STEP)
        shot = page.screenshot()
        if shot == shots[-1]:
            times[-1] += STEP
        else:
            shots.append(shot)
            times.append(STEP)
        if times[-1] > HELD:
            break
    frames = [Image.open(io.BytesIO(shot)).convert("RGB") for shot in shots]
    size = (WIDTH, WIDTH * frames[0].height // frames[0].width)
    small = [frame.resize(size).quantize(SHADES) for frame in frames]
    small[0].save(FILM, save_all=True, append_images=small[1:], duration=times, loop=0)


def main() -> None:
    """Makes both."""
    folder = Path(tempfile.mkdtemp())
    (folder / "own").mkdir()
    with JobPool(2) as pool:
        desk = Served(Offered(pool))
        session = desk.session = Session("picture", folder / "own", desk.services)
        few(session)
        session.tour.set_step(None)
        session.identification.start()
        wait(session)
        session.diagnosis.search()
        wait(session)
        session.show("Diagnose")
        session.playback.move(time=AT)
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
            page = browser.new_page(viewport=SIZE)
            page.goto(desk.address)
            page.get_by_role("button", name=ADD, exact=True).wait_for()
            page.wait_for_timeout(SETTLED)
            page.screenshot(path=PICTURE)
            film(page)
            browser.close()
        desk.server.stop()
        session.close()
    shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
