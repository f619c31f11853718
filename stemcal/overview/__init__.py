"""What a study asks for and what has become of it: plan, status, verify, retry."""
