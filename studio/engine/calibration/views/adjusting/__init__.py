"""The cameras of an adjustment, left and right in their pictures, and the adjustment of all at once."""
