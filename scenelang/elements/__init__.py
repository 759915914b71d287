"""What users bring: shapes that are data, in files that scenes import."""
