"""Figures of the farm and of this process, for Prometheus and for autoscalers.

access      who may read them without a key
readings    what database, broker and store say now, each within a time limit
families    a reading as metrics of Prometheus
scrape      the text of one scrape
waiting     the work that waits for slots

The figures of this process are in `service.instruments`, where every part of the service counts.
"""
