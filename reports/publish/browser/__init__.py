"""Looking at a published report in Chromium: pictures of it for documents, and how large and how quick it is."""
