"""The documentation as a site for a browser, made from the Markdown pages of the installed package without the network.

pages     which pages there are, and where they lie
markdown  one page as HTML: links lead to the other pages of the site, headings, and names in tables, have anchors
site      the whole site in a folder, with pictures and style sheet
"""
