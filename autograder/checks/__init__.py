"""What a check cell uses: `launch`, the expectations, the values that vary."""
