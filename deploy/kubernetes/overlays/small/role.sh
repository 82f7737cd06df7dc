# The image of PostgreSQL runs this once, in an empty database: the role of the service, with a schema of its own.
psql --username "${POSTGRES_USER:-postgres}" --dbname "$POSTGRES_DB" --set ON_ERROR_STOP=1 \
  --set password="$(cat /run/secrets/lippmann)" <<'SQL'
CREATE ROLE lippmann LOGIN PASSWORD :'password' NOSUPERUSER NOCREATEDB NOCREATEROLE NOREPLICATION;
REVOKE ALL ON DATABASE farm FROM PUBLIC;
GRANT CONNECT ON DATABASE farm TO lippmann;
REVOKE ALL ON SCHEMA public FROM PUBLIC;
CREATE SCHEMA lippmann AUTHORIZATION lippmann;
SQL
