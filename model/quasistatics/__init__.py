"""Static solutions and load paths, on flat and curved roads."""
