"""Files in the formats of print shops and of research: from arrays and numbers to disk, one format a module."""
