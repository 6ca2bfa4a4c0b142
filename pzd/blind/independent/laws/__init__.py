"""The laws that the library of effects names, written anew from their sources, one file each."""
