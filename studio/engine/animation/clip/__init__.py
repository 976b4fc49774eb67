"""From a solve to the content of a file: trimming, cleaning, loops, root motion, and the bones of other programs."""
