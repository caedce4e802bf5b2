"""The centre: linked traces against time."""
