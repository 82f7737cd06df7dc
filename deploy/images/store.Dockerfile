# SeaweedFS, an S3 server, as the user of our own images: its image would start as root.
FROM chrislusf/seaweedfs:4.48
USER 0
RUN install -d -m 0700 -o 10001 -g 10001 /store
USER 10001
VOLUME /store
ENTRYPOINT []
CMD ["weed", "server", "-dir=/store"]
