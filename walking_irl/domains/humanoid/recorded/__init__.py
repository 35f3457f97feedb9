"""Recordings of people: files of motion-capture programs in, a cycle of the model's joints out."""
