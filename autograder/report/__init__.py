"""The views of a result: HTML, terminal and JUnit; JSON is the result itself."""
