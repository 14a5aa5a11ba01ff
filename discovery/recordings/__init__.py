"""Recordings of one machine: the campaign file, its channels, and readings where they were taken."""

from discovery.recordings.campaign import Campaign, Channel, Recording, load_campaign
from discovery.recordings.sampling import sample_input

__all__ = ["Campaign", "Channel", "Recording", "load_campaign", "sample_input"]
