"""Neural style fields (Michel et al. 2022): shared by methods that colour and move vertices."""
