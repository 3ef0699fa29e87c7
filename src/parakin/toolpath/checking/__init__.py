"""What a posted path breaks between its records."""
