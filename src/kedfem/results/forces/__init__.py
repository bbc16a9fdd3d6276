"""Forces and moments in joints, of force elements and of rigid links."""
