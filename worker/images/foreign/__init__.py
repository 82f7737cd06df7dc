"""Pictures of other programs, which nobody here trusts.

header        the headers, read by content and bounded
decoder       the program that decodes one picture inside the sandbox
colour_space  what the codes of such pictures mean
upright       a picture turned as its orientation tag says
notes         what the user should know of such pictures
"""
