"""Every channel against its siblings and against the other recordings of the campaign."""
