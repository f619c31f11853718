"""Output for people: tables for the terminal, figures, files for publication, and the HTML report page."""
