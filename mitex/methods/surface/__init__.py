"""Surface-aware mesh texture synthesis (Kovacs, Hermosilla and Raidou 2024)."""
