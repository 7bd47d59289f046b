"""Answers as text, JSON, CSV and HTML; one module for each kind of answer."""
