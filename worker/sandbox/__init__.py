"""The sandbox: everything foreign runs here."""
