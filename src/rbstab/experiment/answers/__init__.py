"""What a run tells about stability, first of all: answers in words that say how sure they are."""
