# The service: API, coordinator and dashboard. PNGs are made from EXR with OpenImageIO, which is in the lock.
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
RUN useradd --system --uid 10001 --create-home lippmann && install -d -o lippmann -g lippmann /data
COPY --from=build /opt/lippmann /opt/lippmann
ENV PATH=/opt/lippmann/bin:$PATH
USER 10001
VOLUME /data
EXPOSE 8080
CMD ["lippmann", "serve", "--host", "0.0.0.0", "--port", "8080"]
