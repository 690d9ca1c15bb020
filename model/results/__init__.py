"""What a contact solution shows: fields, pressure, limits of linear strain, XDMF."""
