"""The calibrated parameters in another program or on another mesh, corrected until the response is right there."""
