"""What people read: tables for the terminal, figures, and one HTML page."""
