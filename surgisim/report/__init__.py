"""A run on one page that needs nothing else: pictures, films, curves and numbers inside one HTML file."""
