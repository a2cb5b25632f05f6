"""The picture of the page in the README: `python -m tests.page.picture [FILE]`.

A hidden effect on short recordings, found and not added yet: ladder, missing torque with the law of
the first candidate, the arm in the colours of its error, and the ranking.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

import viser
from playwright.sync_api import sync_playwright

from flexgui.jobs import JobPool
from flexgui.page.in_browser import plotly_script, run_javascript
from flexgui.server.viser_patches import expect_plotly
from flexgui.session.session import Session
from tests.conftest import CHROMIUM, FLAGS, ROOT
from tests.page.conftest import Desktop, Offered
from tests.page.test_diagnose import few

WHERE = ROOT / "flexgui" / "pictures" / "page.png"
SIZE = {"width": 1600, "height": 900}
SETTLED = 4000
"""ms after which everything is drawn, without a graphics card too."""
AT = 0.4
"""s of the recording, where the arm is bent and fails."""


class Served(Desktop):
    """Draws with the same Plotly as the server does; without viser's button to share."""

    def _connected(self, client: viser.ClientHandle) -> None:
        run_javascript(client, plotly_script())
        expect_plotly(client)
        client.gui.configure_theme(show_logo=False, show_share_button=False)
        super()._connected(client)


def wait(session: Session) -> None:
    """Until nothing is computed."""
    while session.run.busy:
        time.sleep(0.2)


def main(where: Path) -> None:
    """Makes the picture."""
    folder = Path(tempfile.mkdtemp())
    (folder / "own").mkdir()
    with JobPool(2) as pool:
        desk = Served(Offered(pool))
        session = desk.session = Session("picture", folder / "own", desk.services)
        few(session)
        session.tour.go_on(None)
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
            page.get_by_role("button", name="Add Coulomb friction", exact=True).wait_for()
            page.wait_for_timeout(SETTLED)
            page.screenshot(path=where)
            browser.close()
        desk.server.stop()
        session.close()
    shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else WHERE)
