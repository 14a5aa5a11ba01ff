"""The first hour: files from an engineer's own CSV, words explained, schemas for editors."""
