"""CL files, in the APT dialect CATIA writes and the one of Siemens NX."""
