"""Show a result as HTML, on the terminal or in other formats. The JSON form is the result itself."""
