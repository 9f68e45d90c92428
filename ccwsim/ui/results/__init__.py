"""What several pages show of results: charts, gallery, E-type, tables."""
