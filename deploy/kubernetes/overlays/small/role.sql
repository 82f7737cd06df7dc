-- The role of the service, as docs/operations.md says. The image of PostgreSQL runs this once, on an empty volume.
\set password `cat /run/secrets/database-password`
CREATE ROLE lippmann LOGIN PASSWORD :'password' NOSUPERUSER NOCREATEDB NOCREATEROLE NOREPLICATION;
REVOKE ALL ON DATABASE farm FROM PUBLIC;
GRANT CONNECT ON DATABASE farm TO lippmann;
REVOKE ALL ON SCHEMA public FROM PUBLIC;
CREATE SCHEMA lippmann AUTHORIZATION lippmann;
