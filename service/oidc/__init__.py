"""Login with an account of an OpenID provider: the authorisation code flow with PKCE (OpenID Connect Core 1.0).

handshake  what one login remembers between its two requests: state, nonce and verifier
provider   the requests to the provider, with limits: its description, its keys, the exchange of a code
id_token   the checks of an ID token
account    from the claims of an account to an owner and a role

Nothing else imports authlib and joserfc, and the service imports this folder only if `LIPPMANN_OIDC_ISSUER` is set.
"""
