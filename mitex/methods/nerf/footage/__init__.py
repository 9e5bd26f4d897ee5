"""From a phone video, or plain photos, to a capture."""
