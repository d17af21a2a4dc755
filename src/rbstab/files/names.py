"""Names of files as text, whatever Python could decode of them."""


def readable_name(text: str) -> str:
    """Return a text in which the bytes of UTF-8 that Python could not decode are decoded.

    In the C locale without Python's UTF-8 mode, each byte of a name above 127 becomes a lone
    surrogate. Bytes that are not UTF-8 stay as they are.
    """
    if text.isascii():
        return text
    try:
        return text.encode("utf-8", "surrogateescape").decode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        # A surrogate that stands for no byte.
        return text
