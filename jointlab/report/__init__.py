"""The report: one self-contained HTML file with the paper's figures and tables for this bench."""
