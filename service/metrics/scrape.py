"""The text of one scrape: the figures of this process, and those of the farm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from prometheus_client import generate_latest
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from service.health import package_version
from service.instruments import PROCESS
from service.metrics.families import families
from service.metrics.readings import FarmReading
from service.settings import Settings

MEDIA_TYPE = CONTENT_TYPE_PLAIN_0_0_4


class _Given(Collector):
    """A collector of metrics that are known already."""

    def __init__(self, metrics: Sequence[Metric]) -> None:
        self._metrics = metrics

    def collect(self) -> Iterable[Metric]:
        return self._metrics


def scrape_text(reading: FarmReading, settings: Settings, *, streams: int) -> bytes:
    """Return the text format of Prometheus, version 0.0.4.

    Parameters
    ----------
    streams
        The number of event streams that are open in this process.
    """
    build = GaugeMetricFamily("lippmann_build_info", "The version of this process.", labels=("version",))
    build.add_metric((package_version(),), 1)
    open_streams = GaugeMetricFamily("lippmann_event_streams", "Event streams that are open in this process.", streams)
    farm = _Given([build, open_streams, *families(reading, settings)])
    return generate_latest(PROCESS) + generate_latest(farm)
