"""The preview beside the form for a new job."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Page, Route, expect

from lippmann.job.messages.previews import PreviewAnswer, PreviewOrder
from tests.broker import Broker
from tests.browser.studio import view
from tests.builders_messages import put_presence, seals_in
from tests.builders_service import presence
from tests.preview_worker import MADE, Answering
from tests.waiting import until
from worker.images.write import write_png

MIDDLE = "canvas => [...canvas.getContext('2d').getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data]"


def _without_a_poster(route: Route) -> None:
    """Answer with the scenes, as if the target of points had no poster."""
    answer = route.fetch()
    page = answer.json()
    for scene in page["items"]:
        scene["poster"] = None if scene["title"] == "Point target" else scene["poster"]
    route.fulfill(response=answer, json=page)


def test_the_first_frame_is_shown_at_once_and_again_after_every_move_of_a_slider(
    page: Page, broker: Broker, tmp_path: Path, log_in: Callable[[], Page]
) -> None:
    orders: list[PreviewOrder] = []

    def answer(order: PreviewOrder) -> PreviewAnswer:
        orders.append(order)
        write_png(tmp_path / "view.png", view(len(orders), 45))
        png = b64encode((tmp_path / "view.png").read_bytes()).decode()
        pictures = {"view_png": png, "view_size": (45, 45), "integral_png": png, "integral_size": (45, 45)}
        return PreviewAnswer(id=order.id, worker="w2", made=MADE.model_copy(update=pictures))

    seals = seals_in(tmp_path)
    offers = presence("w2").model_copy(update={"previews": True})
    put_presence(broker.client, offers, seals, ex=60)
    with Answering(broker.url, answer, seals, name="w2"):
        page.route("**/api/v1/scenes?*", _without_a_poster)
        log_in()
        preview = page.get_by_role("region", name="Preview")
        picture = preview.get_by_role("img", name="View in the middle")
        expect(picture).to_be_visible()
        expect(preview).to_contain_text("Frame 1 with 45 \u00d7 45 lenses of 8 px")
        before = picture.evaluate(MIDDLE)
        page.get_by_label("Offset, slider").press("ArrowRight")
        until(lambda: orders[-1].job.spec.rig.lens_array.offset_mm > 40)
        until(lambda: picture.evaluate(MIDDLE) != before)
        page.get_by_label("Turn of the rig").press("ArrowRight")
        until(lambda: orders[-1].job.stage.location[0] < -17)
        # A scene without a poster has the picture of its preview.
        tile = page.locator(".scene", has_text="Point target")
        page.get_by_label("Point target").check(force=True)
        expect(tile.locator("canvas")).to_be_visible()
