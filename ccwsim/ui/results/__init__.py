"""Results that several pages show: charts, gallery, E-type."""
