"""The effects of the catalogue, a file for each family. A new effect is a class in the file of its family."""
