"""The folder of one take: `take` opens it, `new` makes it, `solves`, `tracked` and `references` are stored in it."""
