"""Tests of the hours a year by place."""
