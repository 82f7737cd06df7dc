"""Webhooks: the URL that a job names gets a signed message when the job is done, failed or cancelled.

receiver   which URLs and addresses a message may go to
signature  the secret of an owner, and the headers that a receiver verifies
post       sends one message to an address that was checked, within a time
outbox     stores a message in the transaction that ends its job
sender     delivers the stored messages, again and again until the receiver has one
"""
