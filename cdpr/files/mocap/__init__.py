"""What motion-capture programs write as text, and how they write a marker not seen."""
