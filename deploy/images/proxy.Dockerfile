# Caddy as the user of our own images. Its file has a capability that a container without capabilities cannot run; every
# user may listen on the ports 80 and 443 of a container.
FROM caddy:2.10-alpine
RUN setcap -r /usr/bin/caddy && install -d -m 0700 -o 10001 -g 10001 /data && chown -R 10001:10001 /data
USER 10001
VOLUME /data
