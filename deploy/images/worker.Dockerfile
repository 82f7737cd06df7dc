# A worker: POV-Ray, its sandbox, and the same code.
FROM python:3.11-slim-bookworm AS build
WORKDIR /src
COPY requirements.lock pyproject.toml README.md LICENSE ./
RUN python -m venv /opt/lippmann \
 && /opt/lippmann/bin/pip install --no-cache-dir --require-hashes --requirement requirements.lock
COPY lippmann lippmann
COPY service service
COPY worker worker
COPY povtemplates povtemplates
RUN /opt/lippmann/bin/pip install --no-cache-dir --no-deps --no-build-isolation .

FROM python:3.11-slim-bookworm
# hadolint ignore=DL3008
RUN apt-get update \
 && apt-get install -y --no-install-recommends povray povray-includes bubblewrap \
 && rm -rf /var/lib/apt/lists/* \
 && useradd --system --uid 10001 --create-home lippmann && install -d -o lippmann -g lippmann /data
COPY --from=build /opt/lippmann /opt/lippmann
ENV PATH=/opt/lippmann/bin:$PATH
USER 10001
VOLUME /data
CMD ["lippmann", "worker"]
