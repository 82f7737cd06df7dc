# A worker: POV-Ray and Mitsuba, their sandbox, and the same code.
FROM python:3.11-slim-bookworm AS build
WORKDIR /src
COPY requirements-build.lock requirements-worker.lock ./
# What builds the wheel stays in this stage; what runs gets nothing but its own lock.
RUN python -m venv --without-pip /opt/lippmann \
 && pip install --no-cache-dir --require-hashes --requirement requirements-build.lock \
 && pip --python /opt/lippmann install --no-cache-dir --require-hashes --requirement requirements-worker.lock
COPY pyproject.toml hatch_build.py README.md LICENSE ./
COPY docs docs
COPY lippmann lippmann
COPY service service
COPY worker worker
COPY povtemplates povtemplates
RUN pip wheel --no-cache-dir --no-deps --no-build-isolation --wheel-dir wheel . \
 && pip --python /opt/lippmann install --no-cache-dir --no-deps --no-index wheel/*.whl

FROM python:3.11-slim-bookworm
# hadolint ignore=DL3008
RUN apt-get update \
 && apt-get install -y --no-install-recommends povray povray-includes bubblewrap libllvm19 \
 && rm -rf /var/lib/apt/lists/* \
 && useradd --system --uid 10001 --create-home lippmann && install -d -m 0700 -o lippmann -g lippmann /data/artifacts /data/scratch \
 && pip uninstall --yes --root-user-action=ignore setuptools wheel pip
COPY --from=build /opt/lippmann /opt/lippmann
ENV PATH=/opt/lippmann/bin:$PATH
USER 10001
VOLUME ["/data/artifacts", "/data/scratch"]
CMD ["lippmann", "worker"]
