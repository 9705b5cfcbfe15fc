"""Images to sightings: tags and markers found and followed in one camera's frames."""
